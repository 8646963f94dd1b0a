"""Whether a verdict is right on a stranger's law."""

from functools import cache
from pathlib import Path

import closed_forms
import numpy as np
import yaml

from diagnosis.catalogue import load_catalogue
from diagnosis.rig import Rig
from diagnosis.settings import read_settings

ROOT = Path(__file__).parents[3]


def right(found, law):
    """Whether slot and state are those of the stranger's law."""
    return found.law is not None and (found.law["slot"], tuple(found.law["state"])) in law.right


def inside(found, drawn):
    """Whether the true curve lies in the band over the whole supported range; None where there is
    no such curve to compare: what an attraction adds is no coefficient."""
    law = drawn.law
    if law is None or law.curve is None or law.right[0][0] not in ("restitution", "friction"):
        return None
    if not found.law or (found.law["slot"], tuple(found.law["state"])) != law.right[0]:
        return None
    return all(_holds(v, drawn, law.right[0][1]) for v in found.law["values"])


def _holds(place, drawn, state):
    x = {k: np.array([np.nanmedian(c)]) for k, c in drawn.levers.items() if not np.isnan(c).all()}
    if state == ("speed",):
        x["drop_height_mm"] = np.array([place["state"] ** 2 / (2e-3 * closed_forms.G)])
    elif state == ("size",):
        x["particle_diameter_mm"] = np.array([place["state"]])
    elif state == ("rate",):
        x["tilt_rate_deg_s"] = np.array([place["state"]])
    else:
        x["particle_diameter_mm"] = place["state"] / closed_forms.speed(x["drop_height_mm"])
    true = float(drawn.law.curve(x, drawn.strength)[0])
    return place["low"] <= true <= place["high"]


@cache
def study():
    """Rig and catalogue of the shipped study."""
    base = yaml.safe_load((ROOT / "config/config.yaml").read_text())["run"]
    return Rig(read_settings(ROOT / "config/diagnosis.yaml"), base), load_catalogue()
