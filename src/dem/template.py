"""A commented run spec, made from the schema so that it cannot disagree with it."""

from pydantic import BaseModel

from dem.spec import RunSpec, parse_spec


def template(experiment: str) -> str:
    """YAML text of a complete spec for an experiment, every key with its description and
    default."""
    spec = parse_spec({"experiment": experiment})  # some defaults depend on the experiment
    lines = [
        f"# A run of the {experiment} experiment. Every value below is the default;",
        "# those of the grains' material, size and contacts are an example's. A file gives them.",
        f"experiment: {experiment}",
    ]
    for name, field in RunSpec.model_fields.items():
        if name == "experiment":
            continue
        value = getattr(spec, name)
        if isinstance(value, BaseModel):
            lines += _section(name, value, 0)
        else:
            lines.append(f"{name}: {_text(value)}  # {field.description}")
    return "\n".join(lines) + "\n"


def _section(name, part, depth):
    pad = "  " * depth
    lines = [f"{pad}{name}:"]
    for key, field in type(part).model_fields.items():
        value = getattr(part, key)
        if isinstance(value, BaseModel):
            lines += _section(key, value, depth + 1)
        else:
            note = field.description or f"one of {', '.join(field.annotation.__args__)}"
            lines.append(f"{pad}  {key}: {_text(value)}  # {note}")
    return lines


def _text(value):
    return "null" if value is None else str(value)
