"""File names as text: a name is bytes, and need not be any."""


def shown(name: str) -> str:
    r"""A name, or a text with names in it, that can be kept and printed: `bad\xff.mcap` where a byte is no UTF-8."""
    return name.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")
