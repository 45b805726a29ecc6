"""Gives one order to a running swarm, as a separate operator (ground/delivery.py decides); explains missing links.

Zenoh retries a link without a message, so a handshake is tried. Only the handshake is sent, and it occupies a place of
the process only for its duration.
"""

from __future__ import annotations

import asyncio
import socket
import ssl
from collections.abc import Iterable
from contextlib import closing, suppress
from pathlib import Path

from flockwire_core import clock
from flockwire_core.domain.order import ENDING, Answer, Order
from flockwire_core.runtime.session import UNKNOWN, RouterAbsentError, Session
from flockwire_core.security.files import files_of
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.processes import OPERATOR

from flockwire_operator.station.operator import Operator

HANDSHAKE_TIME = 1.0  # s for one handshake
NOBODY = "no process listens at the address of {who} ({where})"
SILENT = "no answer from the host of {who} ({where})"
STRANGE = "{who} has a certificate of another authority than the keys in {keys}, or for another address"
UNTIMELY = "{who} has a certificate that is not valid by this machine's clock; set the clock"
NOT_YET, EXPIRED = 9, 10  # X509_V_ERR_CERT_NOT_YET_VALID, X509_V_ERR_CERT_HAS_EXPIRED
REFUSED = "{who} refuses the keys in {keys}"
SLOW = "{who} runs, but was not linked in time"
UNEXPLAINED = "no link to {who} ({where}); QUIC does not report why"


async def give(plan: Plan, keys: Path, order: Order) -> Answer:
    """Give one order that was requested at the start of this process; raises CredentialsError."""
    try:
        session = Session(plan, OPERATOR.kind, keys, verified=order.verb not in ENDING)
    except RouterAbsentError:
        why = await why_unlinked(plan, keys, plan.routers)
        return Answer(refusal=f"the router at {plan.endpoints[plan.routers[0]]} does not answer: {why}")
    with session:
        operator, answers = Operator(session), list[Answer]()
        operator.ask(order, clock.uptime(), answers.append)
        answer = await operator.run(lambda _: answers[0] if answers else None)
        return await _explained(answer, plan, keys, session, bool(operator.statuses)) if answer.failure else answer


async def _explained(answer: Answer, plan: Plan, keys: Path, session: Session, heard: bool) -> Answer:
    """Return a bad answer with the causes of missing links; `heard`: a process was linked."""
    linked, dialled = session.linked(), plan.dials[OPERATOR.kind]
    absent = [other for other in dialled if other not in linked]
    if not absent or UNKNOWN in linked:
        return answer
    if heard and len(absent) == len(dialled):
        return answer._replace(refusal=f"{answer.failure}; no process is linked any more")
    why = await why_unlinked(plan, keys, absent)
    if len(absent) == len(dialled):
        return answer._replace(refusal=f"nothing was sent: no process is linked: {why}")
    return answer._replace(refusal=f"{answer.failure}; {why}")


async def why_unlinked(plan: Plan, keys: Path, others: Iterable[str]) -> str:
    """Return why the operator is not linked to `others`, which it dials: a clause for each cause."""
    wanted = {other: plan.dialled(OPERATOR.kind, other) for other in others}
    context = _context(plan, keys)
    causes = await asyncio.gather(*(_cause(plan, endpoint, context) for endpoint in wanted.values()))
    clauses = []
    for cause in dict.fromkeys(causes):
        named = [other for other, found in zip(wanted, causes, strict=True) if found == cause]
        where = f"{wanted[named[0]]}, network.base_port = {plan.swarm.network.base_port}"
        clauses.append(cause.format(who=", ".join(named), where=where, keys=keys))
    return "; ".join(clauses)


def _context(plan: Plan, keys: Path) -> ssl.SSLContext | None:
    if plan.swarm.network.security == "none":
        return None
    files = files_of(keys, OPERATOR.kind)
    with suppress(OSError):  # unreadable keys do not delay a link
        context = ssl.create_default_context(cafile=files.authority)
        context.load_cert_chain(files.certificate, files.key)
        return context
    return None


async def _cause(plan: Plan, endpoint: str, context: ssl.SSLContext | None) -> str:
    address, _, port = endpoint.rpartition(":")
    host, quic = address.strip("[]"), plan.over_quic
    try:
        async with asyncio.timeout(HANDSHAKE_TIME):
            await (_datagram(host, int(port)) if quic else _handshake(host, int(port), context))
    except ssl.SSLCertVerificationError as error:
        return UNTIMELY if error.verify_code in (NOT_YET, EXPIRED) else STRANGE
    except (ssl.SSLError, ConnectionResetError):
        return REFUSED
    except ConnectionRefusedError:
        return NOBODY
    except TimeoutError:
        return UNEXPLAINED if quic else SILENT
    except OSError:
        return SILENT
    return SLOW


async def _handshake(host: str, port: int, context: ssl.SSLContext | None) -> None:
    """Connect, and wait a little for a refusal: the server checks our certificate after our handshake."""
    reader, writer = await asyncio.open_connection(host, port, ssl=context)
    with closing(writer), suppress(TimeoutError):  # it waits for Zenoh's first message
        await asyncio.wait_for(reader.read(1), HANDSHAKE_TIME / 2)


async def _datagram(host: str, port: int) -> None:
    """Raise ConnectionRefusedError if the host reports that `port` is closed."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family, socket.SOCK_DGRAM) as probe:
        probe.setblocking(False)
        probe.connect((host, port))
        probe.send(b"\0")
        await asyncio.get_running_loop().sock_recv(probe, 1)
