"""The child process of the Vicon source: connects, waits for frames, writes each as a line of JSON.

    python -P -m flockwire_mocap.vicon.child SERVER

A frame is [arrival, {name: [x, y, z, qx, qy, qz, qw]}]. The arrival is in ns of the monotonic clock, read here, so that
it includes the time in the pipe. A line of text is an error of the package.

It is a separate process because the package's connect, without a server, neither returns nor releases the interpreter.
"""

from __future__ import annotations

import json
import sys
from typing import Any

from flockwire_core import clock

from flockwire_mocap.persistent import imported


def row(body: Any) -> list[float]:  # noqa: ANN401  (the package has no types)
    """Return position and quaternion x y z w of a body of the package."""
    turn = body.rotation
    return [*map(float, body.position), turn.x, turn.y, turn.z, turn.w]


def main() -> int:
    """Write frames until the parent is gone."""
    try:
        package = imported("motioncapture", "vicon")
        system = package.connect("vicon", {"hostname": sys.argv[1]})
        while True:
            system.waitForNextFrame()
            came = clock.monotonic()
            print(json.dumps([came, {name: row(body) for name, body in system.rigidBodies.items()}]), flush=True)
    except BrokenPipeError:
        return 0
    except (OSError, RuntimeError) as error:
        print(json.dumps(str(error)), flush=True)
        return 1


if __name__ == "__main__":
    sys.exit(main())
