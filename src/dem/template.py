"""A commented run spec, made from the schema so that it cannot disagree with it."""

from pydantic import BaseModel

from dem.spec import parse_spec


def template(experiment: str) -> str:
    """YAML text of a complete spec for an experiment, every key with its description and
    default."""
    spec = parse_spec({"experiment": experiment})  # some defaults depend on the experiment
    lines = [
        f"# A run of the {experiment} experiment. Every value below is the default;",
        "# those of the grains' material, size and contacts are an example's. A file gives them.",
        f"experiment: {experiment}",
    ]
    return "\n".join([*lines, *_lines(spec, "")]) + "\n"


def _lines(part, pad):
    """Lines of a part's keys behind `pad`, and of the parts below it."""
    for key, field in type(part).model_fields.items():
        value = getattr(part, key)
        if isinstance(value, BaseModel):
            yield f"{pad}{key}:"
            yield from _lines(value, f"{pad}  ")
        elif key != "experiment":  # which stands first
            note = field.description or f"one of {', '.join(field.annotation.__args__)}"
            yield f"{pad}{key}: {'null' if value is None else value}  # {note}"
