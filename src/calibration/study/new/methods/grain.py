"""What a grain is: its density, dry or moist, and its size: one diameter, axes measured with a
caliper, or what passes each sieve."""

from calibration.study.new.methods.declare import Method, Question

METHODS = (Method(
    name="grain",
    title="Grain",
    about="The material itself. A powder that is moist or finer than 0.1 mm sticks together.",
    questions=(
        Question(
            "density", "density of a grain, not of the bed (pycnometer)", "density_kg_m3",
            needed=True, option="density", example="1.32 g/cm3",
        ),
        Question(
            "diameter", "diameter of the grain, where it is round", "diameter_mm", option="grain",
            example="4 mm",
            at_its_word=True,  # a powder is finer than the coarse grains that stand for it
        ),
        Question("moisture", "dry, or moist", words=("dry", "moist"), option="moisture",
                 example="dry"),
        Question("material", "a material with published ranges", free=True, option="material",
                 example="wheat"),
    ),
    rank=0,
    own_options=True,
), Method(
    name="axes",
    title="Axes",
    about="Length, width and thickness of single grains with a caliper, a row a grain. They become "
    "a clump of spheres. Without a thickness a grain is as thick as wide.",
    questions=(
        Question("length", "longest axis", "diameter_mm", reading=True, needed=True,
                 example="6.2 mm"),
        Question("width", "middle axis", "diameter_mm", reading=True, needed=True,
                 example="3.3 mm"),
        Question("thickness", "shortest axis", "diameter_mm", reading=True,
                 example="2.9 mm"),
    ),
    rank=1,
), Method(
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
),)  # fmt: skip
