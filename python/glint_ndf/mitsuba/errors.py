"""The error that the Mitsuba plugins raise."""


class PluginError(RuntimeError):
    """An error of a plugin. The message names the plugin, the file where there is one, and what to do.

    Attributes: `plugin` (str), `path` (str or None).
    """

    def __init__(self, plugin, message, path=None):
        where = f"{plugin}: {path}" if path else plugin
        super().__init__(f"{where}: {message}")
        self.plugin = plugin
        self.path = path
