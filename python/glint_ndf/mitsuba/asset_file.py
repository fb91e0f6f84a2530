"""The file of an asset, and whether it is still the one that was opened."""

import os
import time

from .errors import PluginError

#: Seconds between two looks at a file. A look costs microseconds, which matters to scalar variants, which ask one point at a time.
_INTERVAL = 0.25


class AssetFile:
    """Remembers which file was opened. `check` raises an error once another file, or other bytes, are there."""

    def __init__(self, plugin, path):
        self.plugin = plugin
        self.path = os.fspath(path)
        if not os.path.isfile(self.path):
            raise PluginError(plugin, "there is no such file; give the path of a .glint asset", self.path)
        self._identity = self._look()
        self._next = 0.0

    def check(self):
        now = time.monotonic()
        if now < self._next:
            return
        self._next = now + _INTERVAL
        if self._look() != self._identity:
            raise PluginError(
                self.plugin,
                "the asset was replaced, changed or removed after the scene was loaded; load the scene again",
                self.path,
            )

    def _look(self):
        try:
            status = os.stat(self.path)
        except OSError:
            return None
        return status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns
