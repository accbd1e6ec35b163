"""Any message that the schema allows, made from the schema itself."""

from typing import Any

from hypothesis import strategies as st

from telemetry.messages import ImuMean, Stand
from telemetry.quantities import MAX_IMUS, MAX_LIST, MAX_STANDS, ValueKind
from telemetry.schema import SCHEMA, SPEC_OF, MessageField

FINITE = st.floats(allow_nan=False, allow_infinity=False)
SCALAR = st.none() | st.booleans() | st.integers(-(2**63), 2**63 - 1) | FINITE | st.text(max_size=50)
VARIANCES = st.tuples(*[st.floats(0.0, 1e6)] * 3)
COVARIANCE = st.builds(lambda d, c: ((d[0], c, 0.0), (c, d[1], -c), (0.0, -c, d[2])), VARIANCES, st.floats(-1e6, 1e6))
NAMES = st.text(max_size=20)


def vector(limit: float) -> st.SearchStrategy[tuple[float, float, float]]:
    return st.tuples(*[st.floats(-limit, limit)] * 3)


def integers(field: MessageField) -> st.SearchStrategy[int]:
    whole = st.integers(int(field.low), int(field.high))
    if field.enumeration is None:
        return whole
    known = st.sampled_from(list(field.enumeration))  # the codec keeps flags of later nodes too
    return known | whole.map(field.enumeration)


def values(field: MessageField) -> st.SearchStrategy[Any]:
    """Anything that a field may hold."""
    match field.kind:
        case ValueKind.NUMBER:
            return st.floats(field.low, field.high)
        case ValueKind.INTEGER:
            return integers(field)
        case ValueKind.BOOLEAN:
            return st.booleans()
        case ValueKind.TEXT:
            return st.text(max_size=256)
        case ValueKind.BINARY:
            return st.binary(min_size=int(field.low), max_size=int(field.high))
        case ValueKind.VECTOR:
            return vector(field.high)
        case ValueKind.COVARIANCE:
            return COVARIANCE
        case ValueKind.IMUS:
            return st.lists(st.builds(ImuMean, vector(1e3), COVARIANCE), min_size=1, max_size=MAX_IMUS).map(tuple)
        case ValueKind.SCALARS:
            return st.dictionaries(NAMES, SCALAR, max_size=8)
        case ValueKind.VALUES:
            numbers = st.lists(FINITE, max_size=MAX_LIST).map(tuple)
            return st.dictionaries(NAMES, SCALAR | numbers, max_size=8)
        case ValueKind.STANDS:
            return st.lists(st.tuples(st.integers(0, 3), st.floats(field.low, field.high)), max_size=MAX_STANDS).map(
                stands
            )
    raise AssertionError(f"no values are drawn for a field of kind {field.kind}")


def stands(rows: list[tuple[int, float]]) -> tuple[Stand, ...]:
    return tuple(Stand(epoch, 10.0 * n, 10.0 * n + 5.0, md) for n, (epoch, md) in enumerate(rows))


def messages(message: type) -> st.SearchStrategy[Any]:
    """Any message of a type; fields of later schema versions have often the value of before."""
    fields = SPEC_OF[message].fields
    return st.builds(message, **{f.name: values(f) if f.since == 1 else st.just(f.before) | values(f) for f in fields})


MESSAGES: dict[type, st.SearchStrategy[Any]] = {spec.message: messages(spec.message) for spec in SCHEMA}
