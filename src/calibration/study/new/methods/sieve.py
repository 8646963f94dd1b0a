"""A sieve analysis: what passes each sieve."""

from calibration.study.new.methods.declare import Method, Question

METHOD = Method(
    name="sieve",
    title="Sieve analysis",
    about="What passes each sieve, in percent of the mass, a row a sieve; the finest one lets "
    "nothing pass (the pan, at the finest grain).",
    questions=(
        Question("size", "width of the sieve's mesh", "diameter_mm", reading=True, example="4 mm"),
        Question("passing", "mass that passes it, in percent", reading=True, least=-1e-9,
                 most=100.0, example="60"),
        Question("file", "or the table that holds them: diameter_mm, and passing_percent of each "
                 "sieve or mass_percent of each size", free=True, option="sieve", example=""),
    ),
    rank=2,
    own_options=True,
)  # fmt: skip
