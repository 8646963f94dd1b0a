"""What a grain is: its density, its size where no axes and no sieves tell it, dry or moist."""

from calibration.study.new.methods.declare import Method, Question

METHOD = Method(
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
)  # fmt: skip
