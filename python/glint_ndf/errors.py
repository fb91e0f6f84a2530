"""Exceptions of the package. Each says what is wrong, where, and what to do."""

import re


class GlintError(Exception):
    """Base of all errors of the package.

    Attributes:
        rule: stable id of the broken rule, such as ``"format.kind"``; empty if there is none.
        path: file at fault; empty if it is not known.
        exit_code: code with which the command-line tools end for such an error.
    """

    exit_code = 4

    def __init__(self, message: str, rule: str = "", path: str = ""):
        super().__init__(message)
        self.rule = rule
        self.path = path


class ArgumentError(GlintError, ValueError):
    """An argument is missing, unknown or out of range."""

    exit_code = 1


class FileError(GlintError, OSError):
    """A file cannot be opened, read or written."""

    exit_code = 2


class InvalidInputError(GlintError, ValueError):
    """A file or an array was read, but its contents cannot be used."""

    exit_code = 3


class FailedError(GlintError, RuntimeError):
    """The work itself failed: memory, or a tolerance that cannot be met."""

    exit_code = 4


class UnsupportedError(GlintError):
    """A newer version of the format, or a kind of asset that does not hold what is asked for."""

    exit_code = 5


_CLASSES = {e.exit_code: e for e in (ArgumentError, FileError, InvalidInputError, FailedError, UnsupportedError)}


def error_of(code: int, rule: str, path: str, message: str) -> GlintError:
    """The exception for a code of the library. The extension module calls this.

    The library's messages name options of the tools, as --sigma-r or glint-ingest --fix-invalid: here they are arguments.
    """
    named = message.startswith(f"{path}: ") if path else False
    head, text = (path, message[len(path) :]) if named else ("", message)
    text = re.sub(r"(^|(?<=[\s(]))(glint-[a-z]+ )?--([a-z][a-z-]*)", lambda option: option[3].replace("-", "_"), text)
    return _CLASSES.get(code, GlintError)(head + text, rule, path)
