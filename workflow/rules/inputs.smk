"""Functions that give a rule its input files."""

# the parameters that are handed out: the optimum of the chain, or of the draws that meet all tests
BY_JOINT = handed_out_by(SETTINGS) == "joint"
HANDED_OUT = (
    {"draws": f"{STUDY}/joint/draws.csv"}
    if BY_JOINT
    else {"optimum": f"{STUDY}/optimise/optimum.json"}
)
# the stages that the study makes of its own accord: the chain's and its supplements
OWN = [name for name, stage in STAGES.items() if stage.of(SETTINGS)]


def refusing(asked, files=(), hint=lambda: ""):
    """Input function: `files`; refuses a stage for which `asked` raises, with a hint behind why."""

    def check(wildcards):
        try:
            asked()
        except REFUSALS as error:
            raise WorkflowError(in_words(error) + hint())
        return files

    return check


def needs(key, stage):
    """Input function without files: refuses a stage whose key the configuration does not give."""
    return refusing(lambda: given(SETTINGS, key, stage))


def table_that(reads):
    """Input function: the table of measurements; refuses one that `reads` refuses."""
    hint = lambda: other_settings(SETTINGS.measurements)
    return refusing(reads, MEASUREMENTS, hint)


# it has values of the target
measured = table_that(STUDY_OBJECT.measured)
# a diagnosis can be made of it
diagnosed = table_that(lambda: read_all(SETTINGS.measurements))


def shown(wildcards):
    """What the page waits for and shows: what the rules of the chain and of the supplements leave,
    plans among it."""
    names = [rule for name in OWN for rule in STAGES[name].rules(SETTINGS)]
    files = [file for name in names for file in getattr(rules, name).output]
    if "diagnosis" in SETTINGS.supplements:
        files += of_waves("plan.json")
    return files


def also_shown(wildcards):
    """What the page shows too where it has been made: the files of the other stages, by absolute
    paths, of which snakemake knows no rule. It makes nothing that nobody asked for."""
    folders = {
        folder for name in set(STAGES) - {*OWN} for folder in STAGES[name].folders
    }
    found = (STUDY_OBJECT.folder.joinpath(f).glob("*.*") for f in sorted(folders))
    return [local(str(path.resolve())) for paths in found for path in sorted(paths)]


def of_waves(file):
    """A file of each wave; none where single contacts are integrated, so that none of the rules
    that train emulators is run."""
    asked = need_emulators(SETTINGS.measurements)
    return [f"{wave}/{file}" for wave in EACH_WAVE] if asked else []


def training(waves):
    """Inputs that train the emulators after so many waves; none where single contacts are
    integrated."""
    if not need_emulators(SETTINGS.measurements):
        return {}
    folders = ["diagnosis", *(f"diagnosis/wave_{k}" for k in range(1, waves + 1))]
    return {
        "designs": [f"{STUDY}/{folder}/design.json" for folder in folders],
        "plans": [f"{STUDY}/{folder}/plan.json" for folder in folders],
        "runs": runs_of(folders[-1])(None),
    }


def of_supplements(files):
    """Those files {stage: file in its folder} that a supplement of the study makes."""
    return [
        f"{STUDY}/{stage}/{file}"
        for stage, file in files.items()
        if stage in SETTINGS.supplements
    ]
