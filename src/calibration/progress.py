"""How far a campaign is, by what its stages declare of their runs."""

from calibration.campaign import read_plan
from calibration.stages import load_stages
from calibration.store import RunStore
from dem.results import is_current


def progress(config, store=None):
    """(done, todo, mean): a text 'plan finished/total' for each plan that every study makes, the
    runs left, and the mean wall time [s] of those finished, None before the first. As the store's
    index has it: no result is read."""
    done, todo, walls = [], 0, []
    store = store or RunStore(config.runs)
    for task in expecting():
        names = read_plan(f"{config.results}/{config.name}/{task.plans}/plan.json")
        finished = [e for n in names if (e := store.known(n)) and is_current(e["engine"])]
        total = len(names) or task.expected(config)
        done.append(f"{task.plans} {len(finished)}/{total}")
        todo += total - len(finished)
        walls += [e["wall_time_s"] for e in finished if e["wall_time_s"] is not None]
    return done, todo, sum(walls) / len(walls) if walls else None


def expected_runs(config):
    """Number of runs of a study before any has been planned."""
    return sum(task.expected(config) for task in expecting())


def expecting():
    """The declared tasks whose number of runs is known before they plan them, in the stages'
    order."""
    tasks = (task for stage in load_stages().values() for task in stage.tasks)
    return [task for task in tasks if task.expected]
