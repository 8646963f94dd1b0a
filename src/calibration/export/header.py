"""The comment at the head of each export: what it is, where its numbers come from, and what it leaves out."""

import textwrap

WIDTH = 110


def header(mark, title, about, conversion, law, *notes):
    """Comment lines behind `mark`: title, provenance (lines), how rolling friction was converted, and notes.

    conversion: `Conversion`; law: `elastic_plastic` in that code's words.
    """
    out = []
    for text in (title, *about, *conversion.sentences(law), *notes):
        out += [f"{mark} {line}" for line in textwrap.wrap(text, WIDTH - len(mark))]
    return out


def no_torsion(spec):
    """Sentences on the torsion of the calibrated `RunSpec` for a code whose contacts do not resist it."""
    if spec.laws.torsion == "none":
        return []
    return [
        f"NOT CONVERTED: torsion {spec.laws.torsion}; a grain that spins about the normal of its contact spins on."
    ]


def left_out(spec):
    """Sentences on laws of the calibrated `RunSpec` that no export carries over."""
    laws, out = spec.laws, []
    if laws.damping in ("viscoelastic", "plastic"):
        out.append(
            f"NOT CONVERTED: damping {laws.damping}, whose restitution depends on the impact speed; the constant "
            "coefficient of restitution stands in its place."
        )
    if laws.friction != "constant":
        out.append(
            f"NOT CONVERTED: friction {laws.friction}; the coefficient is that without load dependence."
        )
    if laws.cohesion != "none":
        out.append(f"NOT CONVERTED: cohesion {laws.cohesion}; these grains do not stick.")
    if laws.drag != "none":
        out.append(f"NOT CONVERTED: drag {laws.drag}; these grains fall in a vacuum.")
    if spec.particles.elongation != 1.0:
        out.append(
            f"NOT CONVERTED: grains {spec.particles.elongation:g} times as long as wide; these are spheres of the same "
            "volume."
        )
    if spec.particles.sizes is not None:
        out.append("The mean grain stands for all sizes where a number depends on the size.")
    return out
