"""The controller's code page CP1252, to and from str."""

from __future__ import annotations

import codecs

from millrace._errors import TextError

#: Bytes that a string of the controller holds.
MAX_TEXT = 127

#: The five bytes that CP1252 leaves open are the C1 controls of the same number, as in the WHATWG encoding standard.
_TABLE = "".join(
    chr(byte) if byte in (0x81, 0x8D, 0x8F, 0x90, 0x9D) else bytes((byte,)).decode("cp1252") for byte in range(256)
)
_BYTES = codecs.charmap_build(_TABLE)


def decode(data: bytes) -> str:
    """The characters of CP1252 bytes; every byte has one."""
    # A table may be a str; typeshed does not know that.
    return codecs.charmap_decode(data, "strict", _TABLE)[0]  # type: ignore[arg-type]


def encode(text: str | bytes) -> bytes:
    """The CP1252 bytes of a text; bytes stay as they are.

    Raises TextError, which names the first character that CP1252 does not have.
    """
    if isinstance(text, (bytes, bytearray)):
        return bytes(text)
    if not isinstance(text, str):
        raise TypeError(f"a text is str or bytes, not {type(text).__name__}")
    try:
        return codecs.charmap_encode(text, "strict", _BYTES)[0]
    except UnicodeEncodeError as error:
        character = text[error.start]
        raise TextError(
            f"{character!r} (U+{ord(character):04X}, character {error.start + 1} of the text) is not in CP1252, "
            "the code page of the controller"
        ) from None


#: Characters of a text that a handler made for people: more than a response holds, less than a log line should.
_MAX_WORDS = 1000


def printable(text: str) -> str:
    """A text that is safe in a log: bounded, and control and format characters, also line ends, as escapes."""
    bounded = text[:_MAX_WORDS] + (" …" if len(text) > _MAX_WORDS else "")
    return "".join(
        character
        if character.isprintable()
        else character.encode("unicode_escape", "surrogatepass").decode("ascii")
        for character in bounded
    )


def encode_reason(text: str) -> bytes:
    """The CP1252 bytes of a text that explains an error; '?' in place of what CP1252 does not have."""
    return codecs.charmap_encode(text.replace("\0", " "), "replace", _BYTES)[0]
