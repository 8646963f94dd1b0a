"""Data sets with a hidden effect, drawn by the engine, and their diagnosis."""

import effect

from benchmarks.rates import hidden
from diagnosis.identify import decide, weigh


class Laboratory:
    """Draws data of the engine under a plan and diagnoses them; holds what all data sets share."""

    def __init__(self, emulated, rig, replicates, root, plan):
        self.emulated, self.rig = emulated, rig
        self.replicates, self.root, self.plan = replicates, root, plan
        self._strengths = {}

    def strength(self, name):
        """Return the strength, in its unit, of a moderate effect."""
        if name not in self._strengths:
            found = effect.strength_at(self.emulated, self.plan, name, effect.MODERATE)
            self._strengths[name] = found[0]
        return self._strengths[name]

    def measure(self, point, *effects):
        """Return the measurements of the plan, with these mechanisms at moderate strengths; point:
        of the base parameters and the noise."""
        strengths = {name: self.strength(name) for name in effects}
        return hidden.draw(
            point, self.rig, self.emulated.catalogue, strengths, point, self.plan, self.root
        )

    def identify(self, measured, seed, without=()):
        """Return the `Identification` with some mechanisms taken out of the catalogue."""
        scores = weigh(self.emulated, measured, self.replicates, seed)
        return decide(scores, self.emulated.settings.alpha, without)
