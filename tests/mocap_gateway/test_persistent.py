"""A connection that is kept in spite of errors that nobody foresaw."""

import asyncio

import pytest
from flockwire_mocap.persistent import PersistentConnection
from waiting import until


class Faulty(PersistentConnection):
    """Fails with each of the errors by turns, and is then lost as a connection usually is."""

    PAUSE = 0.001

    def __init__(self, errors):
        super().__init__()
        self.errors, self.reasons = errors, []

    def failed(self, why):
        self.reasons.append(why)

    async def connected(self):
        if self.errors:
            raise self.errors.pop(0)
        return "the server has ended it"


@pytest.mark.parametrize("error", [ValueError("a line\ntoo long"), OSError(11, "no more processes"), KeyError("x")])
def test_an_unexpected_error_is_reported_and_does_not_end_the_attempts(error, caplog):
    async def run():
        client = Faulty([error, error])
        client.open()
        await until(lambda: client.reasons and client.reasons[-1] == "the server has ended it")
        await client.close()
        return client.reasons

    reasons = asyncio.run(run())
    assert reasons[0] == f"the connection failed: {error!r}"
    assert len(reasons[0].splitlines()) == 1
    assert [record.exc_info[1] for record in caplog.records] == [error]  # once, however often
