"""The processes of a host that are none."""

from __future__ import annotations


class Processes:
    """The children, all of which live but those named in `dead`; notes which were started."""

    def __init__(self):
        self.dead, self.took_off, self.started = [], None, []
        self.refusing = False

    def refused(self, identity):
        return self.refusing

    def ended(self):
        return tuple(self.dead)

    def died(self):
        return self.how(self.dead[0]) if self.dead else ""

    def how(self, identity):
        return f"{identity} ended unexpectedly (signal SIGKILL)"

    def kill(self, identity):
        self.dead.remove(identity)  # its exit is expected

    async def end(self, interrupted=None):
        """Nobody is left."""

    def start(self, identity):
        self.started.append(identity)
