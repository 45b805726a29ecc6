"""The test picture of a simulated Tello's camera: 960 x 720, even grey, H.264 Baseline (ITU-T H.264, 7.3 and 9.1).

Each macroblock is Intra_16x16, predicted as DC, without residual: the eight bits 0010 0111.
"""

from __future__ import annotations

from functools import cache

WIDTH, HEIGHT = 60, 45  # macroblocks of 16 pixels
PAYLOAD = 1460  # bytes of a datagram, as a Tello's
SPS, PPS, IDR = 0x67, 0x68, 0x65  # NAL units: type and importance
MACROBLOCK = "00100111"  # mb_type ue(3), intra_chroma_pred_mode ue(0), mb_qp_delta se(0), coeff_token of none


@cache
def test_picture(odd: bool) -> tuple[bytes, ...]:
    """Return the datagrams of one picture; two that follow each other differ in `odd` (idr_pic_id)."""
    sequence = f"{66:08b}{0xC0:08b}{31:08b}" + _ue(0) + _ue(0) + _ue(2) + _ue(1) + "0"  # level 3.1, order by decoding
    sequence += _ue(WIDTH - 1) + _ue(HEIGHT - 1) + "1100"  # frames only
    parameters = _ue(0) + _ue(0) + "00" + _ue(0) + _ue(0) + _ue(0) + "000" + _ue(0) + _ue(0) + _ue(0) + "000"
    header = _ue(0) + _ue(7) + _ue(0) + "0000" + _ue(int(odd)) + "00" + _ue(0)  # first macroblock, I slice, frame 0
    stream = _unit(SPS, sequence) + _unit(PPS, parameters) + _unit(IDR, header + MACROBLOCK * (WIDTH * HEIGHT))
    return tuple(stream[k : k + PAYLOAD] for k in range(0, len(stream), PAYLOAD))


def _ue(number: int) -> str:
    """Return the Exp-Golomb code of `number`, 9.1; of 0 it is also that of a signed 0."""
    bits = f"{number + 1:b}"
    return "0" * (len(bits) - 1) + bits


def _unit(kind: int, bits: str) -> bytes:
    """Return a NAL unit with its start code, Annex B; no emulation of a start code can occur in these."""
    bits += "1"
    bits += "0" * (-len(bits) % 8)
    return b"\0\0\0\1" + bytes((kind, *(int(bits[k : k + 8], 2) for k in range(0, len(bits), 8))))
