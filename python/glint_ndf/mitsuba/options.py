"""Parameters of a plugin: those that are known, and what each may be."""

import difflib

from .errors import PluginError


class Options:
    """Reads the parameters of one plugin. Errors name the plugin, the parameter and what it may be.

    Every parameter that the plugin reads is marked as known; `finish` refuses the others.
    """

    def __init__(self, plugin, props, prefix="", known=None):
        self.plugin, self._props, self._prefix = plugin, props, prefix
        self._known = {"id"} if known is None else known

    def under(self, prefix):
        """The options whose names begin with a prefix, which is left out when they are asked for."""
        return Options(self.plugin, self._props, prefix, self._known)

    def text(self, name, default=None, choices=None):
        value = self._get(name, default)
        if value is None:
            return None
        if not isinstance(value, str):
            self.refuse(name, f"must be a text, and is {value!r}")
        if choices and value not in choices:
            self.refuse(name, f"must be one of {', '.join(choices)}, and is '{value}'")
        return value

    def number(self, name, default=None, low=None, high=None, above=None):
        value = self._get(name, default)
        if value is None:
            return None
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            self.refuse(name, f"must be a number, and is {value!r}")
        if value != value or (low is not None and value < low) or (high is not None and value > high):
            self.refuse(name, f"must be from {low} to {'any' if high is None else high}, and is {value}")
        if above is not None and not value > above:
            self.refuse(name, f"must be above {above}, and is {value}")
        return float(value)

    def integer(self, name, default=None, low=None):
        value = self._get(name, default)
        if value is None:
            return None
        if isinstance(value, bool) or not isinstance(value, int) or (low is not None and value < low):
            self.refuse(name, f"must be a whole number of at least {low}, and is {value!r}")
        return value

    def flag(self, name, default=False):
        value = self._get(name, default)
        if not isinstance(value, bool):
            self.refuse(name, f"must be true or false, and is {value!r}")
        return value

    def texture(self, name):
        """A texture or a number, as a texture; None where it is not given."""
        self._known.add(self._prefix + name)
        return self._props.get_texture(self._prefix + name, 0.0) if self._prefix + name in self._props else None

    def object(self, name, kind, what):
        """A nested plugin of a class of Mitsuba, or None."""
        value = self._get(name, None)
        if value is not None and not isinstance(value, kind):
            self.refuse(name, f"must be {what}, and is {value!r}")
        return value

    def given(self, name):
        """Whether a parameter is given."""
        return self._prefix + name in self._props

    def any_of(self, names):
        """Marks parameters as known without reading them. Returns those that are given."""
        self._known.update(names)
        return [name for name in names if name in self._props]

    def finish(self):
        """Refuses parameters that were not read."""
        for name in self._props.keys():
            if name not in self._known and not name.startswith("_arg_"):
                near = difflib.get_close_matches(name, self._known, 1)
                hint = f"; did you mean '{near[0]}'?" if near else ""
                raise PluginError(self.plugin, f"unknown parameter '{name}'{hint} Known: {', '.join(sorted(self._known))}")

    def refuse(self, name, message):
        raise PluginError(self.plugin, f"parameter '{self._prefix}{name}' {message}")

    def _get(self, name, default):
        name = self._prefix + name
        self._known.add(name)
        return self._props[name] if name in self._props else default
