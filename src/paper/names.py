"""The paper's factors as people say them."""

SAID = {
    "salt_steel_restitution": "restitution, salt on steel",
    "salt_steel_static_friction": "static friction, salt on steel",
    "salt_steel_rolling_friction": "rolling friction, salt on steel",
    "salt_poisson_ratio": "Poisson's ratio of salt",
    "salt_salt_restitution": "restitution, salt on salt",
    "salt_salt_static_friction": "static friction, salt on salt",
    "salt_salt_rolling_friction": "rolling friction, salt on salt",
}


def said(name):
    """A factor's name in words; of another than the paper's, its name without underscores."""
    return SAID.get(name, name.replace("_", " "))


def in_sentence(text):
    """A text of the stages with the paper's factors as people say them: "rolling friction of salt
    on steel", for their names stand in lists there."""
    for name, words in SAID.items():
        label, words = name.replace("_", " "), words.replace(", salt", " of salt")
        text = text.replace(label[0].upper() + label[1:], words[0].upper() + words[1:])
        text = text.replace(label, words)
    return text
