"""What the search for equivalent rolling friction found, as numbers and sentences for the exports."""

from dataclasses import dataclass

from calibration.export.rolling import DAMPING_RATIO, STIFFNESS_FACTOR, laws_to_scan


@dataclass(frozen=True)
class Equivalent:
    """Numbers of a law that give the calibrated angle."""

    rolling_friction: float
    stiffness_factor: float
    damping_ratio: float


class Conversion:
    """What rolling.json says, as the exports need it."""

    def __init__(self, spec, found=None):
        """spec: calibrated `RunSpec`; found: content of rolling.json, or None before the search."""
        self.spec, self.found = spec, found

    def of(self, law):
        """`Equivalent` for a law: the calibrated numbers where the law is the same or nothing rolls."""
        entry, q = self._entry(law) or {}, self.spec.law_parameters
        own = self.spec.laws.rolling == law
        factor = q.rolling_stiffness_factor if own else entry.get("stiffness_factor")
        damping = q.rolling_damping_ratio if own else entry.get("damping_ratio")
        return Equivalent(
            entry.get("rolling_friction", self.spec.contacts.particle_particle.rolling_friction),
            STIFFNESS_FACTOR if factor is None else factor,
            DAMPING_RATIO if damping is None else damping,
        )

    def sentences(self, law, name):
        """What was done about rolling friction, for the head of a file; `name`: the law in that code's words."""
        entry, own = self._entry(law), self.found
        if entry is None:
            return [self._without_search(law, name)]
        unit = own["unit"]
        out = [
            f"Rolling friction: calibrated as {own['law']} with mu_r = {own['rolling_friction']:.4g}. {name} is "
            "another law, on the relative spin; there the same number gives "
            f"{entry['with_the_same_number']:.1f} {unit}. mu_r = {entry['rolling_friction']:.4g} below comes from "
            f"runs of this engine's {law} along rising mu_r."
        ]
        if not entry["reached"]:
            out.append(
                "THE CALIBRATED ANGLE IS OUT OF REACH of this law with the other parameters as they are: the search "
                f"came to {entry['smallest']:.1f} to {entry['largest']:.1f} {unit}; the nearest is taken. Calibrating "
                f"in this law (run: {{laws: {{rolling: {law}}}}}) tells whether other parameters can make up for it."
            )
        return out + [_check(entry[s], s, unit) for s in ("coarse", "full") if s in entry]

    def _entry(self, law):
        return self.found["laws"].get(law) if self.found else None

    def _without_search(self, law, name):
        laws = self.spec.laws
        rolls = laws.rolling != "none" and self.spec.contacts.particle_particle.rolling_friction > 0
        if not rolls or laws.rolling == law:
            what = "is the law calibrated with" if rolls else "is off"
            return f"Rolling friction: {name} {what}; the number is used as it is."
        not_converted = (
            f"NOT CONVERTED: rolling friction was calibrated as {laws.rolling}, {name} is another law, and the number "
            "below is the calibrated one."
        )
        if law in laws_to_scan(self.spec):
            return (
                f"{not_converted} The heap is flatter with it. `snakemake -j2 export_converted` searches what gives "
                "the calibrated angle in this law and writes exports/converted/; it makes some thirty heaps."
            )
        return f"{not_converted} Without a heap there is no angle to keep."


def _check(a, scale, unit):
    where = {"coarse": "on the scale of the search", "full": "on the scale of the study"}[scale]
    low, high = a["difference_interval_95"]
    return (
        f"Check {where}: {a['mean']:.2f} {unit} ({a['runs']} runs, sd {a['sd']:.2f}) against "
        f"{a['calibrated_law_mean']:.2f} ({a['calibrated_law_runs']} runs, sd {a['calibrated_law_sd']:.2f}) with the "
        f"calibrated law; difference {a['difference']:+.2f}, 95 % {low:+.2f} to {high:+.2f}."
    )
