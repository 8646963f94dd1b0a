"""EDEM: a table to type into the Creator.

Its conventions, from the user guide (help.altair.com/edem, Creator, Physics): Hertz-Mindlin (no
slip) has the damping of Tsuji, Tanaka and Ishida (1992) and E*, G* of the pair. Coefficients are
given for each pair of materials, so there is no mixing rule. Rolling friction: `standard` is mu_r
F_n R_i against each body's own spin; `RVD` is mu_r F_n R* against the relative spin; `type C` is a
spring 2.25 k_n (mu_r R*)^2, a slider and a dashpot whose damping ratio refers to the inertia about
the contact point, as here.
"""

from calibration.engines.blocks.header import dispensed

CODE = "edem"


def block(material, conversion, about):
    """Markdown. material: `Granulate`; conversion: `Conversion`; about: lines of provenance."""
    g, rolling = material, conversion.export("rolling", CODE)
    rows = [
        ("Bulk material", "Poisson's ratio", g.grain.poisson_ratio, ""),
        ("", "Solids density", g.grain.density, "kg/m3"),
        ("", "Shear modulus", g.grain.shear_modulus, "Pa"),
        ("", "Young's modulus (instead)", g.grain.young_modulus, "Pa"),
        ("Equipment material", "Poisson's ratio", g.wall.poisson_ratio, ""),
        ("", "Solids density", g.wall.density, "kg/m3"),
        ("", "Shear modulus", g.wall.shear_modulus, "Pa"),
        ("", "Young's modulus (instead)", g.wall.young_modulus, "Pa"),
    ]
    for name, p in (
        ("Bulk : bulk", g.grain_grain.contact),
        ("Bulk : equipment", g.grain_wall.contact),
    ):
        rows += [
            (f"Interaction {name}", "Coefficient of restitution", p.restitution, ""),
            ("", "Coefficient of static friction", p.static_friction, ""),
            ("", "Coefficient of rolling friction", p.rolling_friction, ""),
        ]
    heads = [rolling.words]
    for name, value in rolling.numbers(g.grain_grain).items():
        rows.append((heads.pop() if heads else "", name, value, ""))
    rows.append(("Simulator", "Time step", g.time_step, "s"))
    table = [f"| {a} | {b} | {v:.6g} | {u} |" for a, b, v, u in rows]
    note = (
        f"Physics: {rolling.called}. It is the law calibrated with: its numbers are used as they "
        "are."
    )
    notes = [*dispensed(g.spec, CODE), *rolling.notes(g.grain_grain)]
    text = ["# EDEM: parameters to type in", *about, note, *notes]
    head = ["| where | parameter | value | unit |", "|---|---|---|---|"]
    return "\n\n".join(text) + "\n\n" + "\n".join(head + table) + "\n"
