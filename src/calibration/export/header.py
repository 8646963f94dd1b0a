"""The comment at the head of each export: what it is, where its numbers come from, and what it
leaves out."""

import textwrap

from dem.materials import laws_of

WIDTH = 110


def header(mark, title, about, conversion, law, *notes):
    """Comment lines behind `mark`: title, provenance (lines), how rolling friction was converted,
    and notes.

    conversion: `Conversion`; law: `elastic_plastic` in that code's words.
    """
    out = []
    for text in (title, *about, *conversion.sentences(law), *notes):
        out += [f"{mark} {line}" for line in textwrap.wrap(text, WIDTH - len(mark))]
    return out


def no_torsion(spec):
    """Sentences on the torsion of the calibrated `RunSpec` for a code whose contacts do not resist
    it."""
    if spec.laws.torsion == "none":
        return []
    return [
        f"NOT CONVERTED: torsion {spec.laws.torsion}; a grain that spins about the normal of its "
        f"contact spins on."
    ]


def left_out(spec, code=None):
    """Sentences on what an export does not carry over of the calibrated `RunSpec`. code: the module
    that writes the export, whose CARRIED names laws that it alone has; none unless given."""
    carried = getattr(code, "CARRIED", ())
    lost = [law for law in laws_of(spec).chosen() if law.name not in carried]
    out = [law.left_out for law in lost if law.left_out]
    if spec.particles.elongation != 1.0:
        out.append(
            f"NOT CONVERTED: grains {spec.particles.elongation:g} times as long as wide; these are "
            f"spheres of the same "
            "volume."
        )
    if spec.particles.clump is not None:
        number = len(spec.particles.clump.radius_mm)
        out.append(
            f"NOT CONVERTED: grains of {number} bonded spheres; these are spheres of the same "
            "volume."
        )
    if spec.particles.sizes is not None:
        out.append("The mean grain stands for all sizes where a number depends on the size.")
    return out
