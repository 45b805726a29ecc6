from math import cos, exp, isnan, log, pi, sin, sqrt

import pytest
from flockwire_core.control.expression import ExpressionError, bound, derivative, function_of_time
from flockwire_core.control.expression_formation import (
    FORBIDDEN,
    NO_EXPRESSION,
    TOO_DEEP,
    UNKNOWN,
    Parametric,
    parse_expression,
)
from flockwire_core.control.formation import Circle
from flockwire_core.swarm.formation_rules import survey_of
from hypothesis import given
from hypothesis import strategies as st

RANK, COUNT = 2.0, 5.0


def value(text, t=0.7):
    return function_of_time(bound(parse_expression(text), {"i": RANK, "n": COUNT}))(t)


def formation(x, y, z="0", count=5):
    return Parametric(count, (x, y, z))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("2 + 3 * 4", 14.0),
        ("(2 + 3) * 4", 20.0),
        ("8 - 2 - 1", 5.0),
        ("2 ^ 3 ^ 2", 512.0),
        ("2 ** 3", 8.0),
        ("-t ^ 2", -0.49),
        ("2 ^ -1", 0.5),
        ("-(-t)", 0.7),
        ("1e-3 + .5", 0.501),
        ("i + 10 * n", 52.0),
        ("7 % n", 2.0),
        ("floor(i / n) + floor(1.9)", 1.0),
        ("sin(2*pi*i/n)", sin(0.8 * pi)),
        ("atan2(1, -1)", 0.75 * pi),
        ("exp(-t) * log(n)", exp(-0.7) * log(5.0)),
        ("min(i, n) - max(i, n)", -3.0),
        ("e ^ t", exp(0.7)),
    ],
)
def test_an_expression_has_its_mathematical_value(text, expected):
    assert value(text) == pytest.approx(expected, abs=1e-12)


SMOOTH = ("t", "i", "n", "0.5", "2")
expressions = st.recursive(
    st.sampled_from(SMOOTH),
    lambda inner: st.one_of(
        st.builds("({} {} {})".format, inner, st.sampled_from(["+", "-", "*"]), inner),
        st.builds("{}({})".format, st.sampled_from(["sin", "cos", "tanh", "atan"]), inner),
        st.builds("sqrt(2 + sin({}))".format, inner),
        st.builds("({} / (2 + cos({})))".format, inner, inner),
        st.builds("(2 + sin({})) ^ cos({})".format, inner, inner),
        st.builds("atan2({}, 2 + sin({}))".format, inner, inner),
        st.builds("log(3 + sin({})) * asin(0.5 * cos({}))".format, inner, inner),
    ),
    max_leaves=5,
)


@given(expressions, st.floats(0.1, 3.0))
def test_the_derivative_is_that_of_the_expression(text, t):
    tree = bound(parse_expression(text), {"i": RANK, "n": COUNT})
    f, rate, step = function_of_time(tree), function_of_time(derivative(tree)), 1e-5
    slope = (f(t + step) - f(t - step)) / (2.0 * step)
    curvature = abs(f(t + step) - 2.0 * f(t) + f(t - step)) / step**2
    assert rate(t) == pytest.approx(slope, rel=1e-4, abs=1e-4 * (1.0 + curvature))


def test_an_expression_circle_is_the_named_circle():
    x, y = "2.5*sin(0.4*t + 2*pi*i/n)", "2.5*cos(0.4*t + 2*pi*i/n)"
    for count in (1, 4, 12):
        circle, own = Circle(count, 2.5, 0.4), formation(x, y, count=count)
        for index in range(count):
            for k in range(400):
                t = 0.3 * k
                assert own.offset(index, t) == pytest.approx(circle.offset(index, t), abs=1e-9)
                assert own.offset_rate(index, t) == pytest.approx(circle.offset_rate(index, t), abs=1e-9)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("w*t", f"'w' {UNKNOWN}"),
        ("__import__(t)", f"'__import__' {UNKNOWN}"),
        ("t.real", f"'t.real' {FORBIDDEN}"),
        ("open(t)", f"'open' {UNKNOWN}"),
        ("sin.__call__(t)", f"'sin.__call__(t)' {FORBIDDEN}"),
        ("sin(*t)", f"'*t' {FORBIDDEN}"),
        ("sin(a=t)", f"'sin' {UNKNOWN}"),
        ("t if t else 0", f"'t if t else 0' {FORBIDDEN}"),
        ("'a'", f"\"'a'\" {FORBIDDEN}"),
        ("True", f"'True' {FORBIDDEN}"),
        ("2j", f"'2j' {FORBIDDEN}"),
        ("t[0]", f"'t[0]' {FORBIDDEN}"),
        ("t < 2", f"'t < 2' {FORBIDDEN}"),
        ("(t := 2)", f"'(t := 2)' {FORBIDDEN}"),
        ("+t", f"'+t' {FORBIDDEN}"),
        ("sin", f"'sin' {UNKNOWN}"),
        ("sin(t, 2)", "sin() takes 1 argument, not 2"),
        ("atan2(t)", "atan2() takes 2 arguments, not 1"),
        *(
            (text, NO_EXPRESSION)
            for text in ("", "2 *", "2 t", "(t", "t)", "sin(t", "* t", "lambda + t", "t; t", "t\0")
        ),
        ("(" * 200 + "t" + ")" * 200, "has 401 characters, the most is 300"),
        ("sin(" * 45 + "t" + ")" * 45, TOO_DEEP),
        ("-" * 200 + "t", TOO_DEEP),
        ("t" + "^t" * 60, TOO_DEEP),
    ],
)
def test_what_may_not_be_in_an_expression_is_named(text, reason):
    with pytest.raises(ExpressionError) as refused:
        parse_expression(text)
    assert str(refused.value).startswith(reason)


@pytest.mark.parametrize("text", ["abs(t)", "floor(2*t)", "t % 2", "max(t, 1) * i"])
def test_what_would_make_the_velocity_jump_is_refused(text):
    with pytest.raises(ExpressionError, match="it may use only i and n"):
        derivative(parse_expression(text))


def test_long_and_deep_expressions_have_a_derivative():
    for text in ("+".join(["t"] * 60), "*".join(["t"] * 60), "t" + "^t" * 35, "sin(" * 38 + "t" + ")" * 38):
        assert isinstance(function_of_time(derivative(parse_expression(text)))(0.9), float)


def test_where_it_is_not_defined_there_is_no_place_and_no_exception():
    for text in ("sqrt(1 - t)", "1 / (t - 2)", "log(1 - t)", "exp(exp(4*t))", "(1 - t) ^ 0.5", "1 / (i - i)"):
        shape = formation(text, "t")
        assert isnan(sum(shape.offset(0, 2.0))), text


def test_before_time_0_it_stands_at_its_beginning():
    shape = formation("sqrt(t + 0.01)", "t")
    assert shape.offset(0, -0.5) == shape.offset(0, 0.0) == (pytest.approx(0.1), 0.0, 0.0)
    assert shape.offset_rate(0, 1.0)[0] == pytest.approx(0.5 / sqrt(1.01))


def test_circles_of_one_rank_or_more_differ_by_rank_alone():
    shape = formation("i*cos(t)", "n", count=3)
    assert [shape.offset(i, 1.0) for i in range(3)] == [(pytest.approx(i * cos(1.0)), 3.0, 0.0) for i in range(3)]


def test_the_documented_expression_flies(example, make_swarm):
    import tomllib

    swarm = make_swarm({"formations": tomllib.loads(example("formations", "toml"))["formations"]})
    assert survey_of(swarm, "rose").high[2] == pytest.approx(0.2, abs=1e-3)
