"""The access control of every process, judged by an evaluator of Zenoh's rules that knows nothing of how they came."""

from itertools import product

import zenoh
from flockwire_core.runtime.configuration import access_control
from flockwire_core.wire.keys import key_text
from flockwire_core.wire.plan import Plan
from hypothesis import given, settings
from hypothesis import strategies as st
from table_rows import table_rows

ROUTER = "router"
FLOWS = ("egress", "ingress")
MESSAGES = (
    "put", "delete", "declare_subscriber", "query", "declare_queryable", "reply",
    "liveliness_token", "declare_liveliness_subscriber", "liveliness_query",
)  # fmt: skip
STRANGERS = ("", "stranger", "uav99", "UAV1", "uav1 ", "ca")
HARMLESS = "put", "declare_subscriber"


def candidates(swarm):
    """Return all keys of the swarm as they stand on the wire, and what an attacker might ask for instead."""
    name, plan = swarm.name, Plan(swarm)
    return [
        *map(plan.text, plan.keys),
        "**", f"{name}/**", f"{name}/*/estimate", f"{name}/*/*", "*/uav1/*", f"{name}/uav1/*", f"{name}/uav$*/pose",
        f"{name}/uav1", f"{name}/uav1/estimate/more", f"{name}/uav99/pose", f"{name}/uav0/estimate", "other/uav1/pose",
        "uav1/pose", f"{name}/uav1/secret", f"{name}/stop/more", "@/**",
    ]  # fmt: skip


def applies(subject, peer):
    """Return whether a subject is `peer`; what it does not restrict is anybody's."""
    assert subject.keys() <= {"id", "cert_common_names"}
    return peer in subject.get("cert_common_names", [peer])


def covers(expression, key):
    """Return whether a rule's key expression includes a key or key expression."""
    return expression == key or ("*" in expression and zenoh.KeyExpr(expression).includes(zenoh.KeyExpr(key)))


def evaluate(control, peers, keys):
    """Return all (peer, flow, message, key) that Zenoh lets pass under `control`."""
    assert control["enabled"] is True
    assert control["default_permission"] == "deny"
    rules = {rule["id"]: rule for rule in control["rules"]}
    subjects = {subject["id"]: subject for subject in control["subjects"]}
    verdicts = {"allow": set(), "deny": set()}
    for peer, entry in product(peers, control["policies"]):
        if any(applies(subjects[name], peer) for name in entry["subjects"]):
            for rule in (rules[name] for name in entry["rules"]):
                covered = [key for key in keys if any(covers(expression, key) for expression in rule["key_exprs"])]
                cells = product([peer], rule.get("flows", FLOWS), rule.get("messages", MESSAGES), covered)
                verdicts[rule["permission"]].update(cells)
    return verdicts["allow"] - verdicts["deny"]


def promised(swarm, identity):
    """Return the (peer, flow, message, key) that key table and graph allow `identity`, straight from the table."""
    cells = set()
    for key, publishers, subscribers in table_rows(swarm):
        text = key_text(swarm.name, key)
        for publisher, subscriber in product(publishers, subscribers):
            for sender, receiver in legs(swarm, publisher, subscriber):
                if sender == identity:
                    cells |= {(receiver, "egress", "put", text), (receiver, "ingress", "declare_subscriber", text)}
                if receiver == identity:
                    cells |= {(sender, "ingress", "put", text), (sender, "egress", "declare_subscriber", text)}
    return cells


def legs(swarm, publisher, subscriber):
    """Return the links that a message takes from `publisher` to `subscriber`."""
    if swarm.network.mode == "peers":
        return {(publisher, subscriber)} if publisher != subscriber else set()
    return {(a, b) for a, b in ((publisher, ROUTER), (ROUTER, subscriber)) if a != b}


@settings(max_examples=20)
@given(data=st.data())
def test_the_rules_allow_exactly_what_key_table_and_graph_do(plans, data):
    plan = data.draw(plans)
    keys, peers = candidates(plan.swarm), (*plan.identities, *STRANGERS)
    for identity in plan.identities:
        allowed = evaluate(access_control(plan, identity), peers, keys)
        expected = promised(plan.swarm, identity)
        assert allowed - expected == set(), f"{identity} allows too much"
        assert expected - allowed == set(), f"{identity} allows too little"


@settings(max_examples=20)
@given(data=st.data())
def test_both_ends_of_a_link_guard_it(plans, data):
    plan = data.draw(plans)
    keys, peers = candidates(plan.swarm), plan.identities
    allowed = {identity: evaluate(access_control(plan, identity), peers, keys) for identity in peers}
    for identity, cells in allowed.items():
        for peer, flow, message, key in cells:
            other_end = "ingress" if flow == "egress" else "egress"
            assert (identity, other_end, message, key) in allowed[peer]


@settings(max_examples=15)
@given(data=st.data())
def test_what_a_follower_estimates_reaches_its_subscribers_alone(plans, data):
    """The information constraint itself, from the graph's edges: no rule lets an estimate anywhere else."""
    plan = data.draw(plans.filter(lambda plan: not plan.routers))
    edges = {(f"uav{edge[0]}", f"uav{edge[1]}") for edge in plan.swarm.graph.edges}
    followers = [f"uav{i}" for i in plan.swarm.followers]
    for publisher, subscriber in product(followers, followers):
        if publisher != subscriber:
            text = f"{plan.swarm.name}/{publisher}/estimate"
            out = evaluate(access_control(plan, publisher), [subscriber], [text])
            back = evaluate(access_control(plan, subscriber), [publisher], [text])
            assert ((subscriber, "egress", "put", text) in out) == ((publisher, subscriber) in edges)
            assert ((publisher, "ingress", "put", text) in back) == ((publisher, subscriber) in edges)


@settings(max_examples=20)
@given(data=st.data())
def test_no_rule_has_a_wildcard_or_any_other_verb(plans, data):
    plan = data.draw(plans)
    spelled = {plan.text(key) for key in plan.keys}
    for identity in plan.identities:
        control = access_control(plan, identity)
        for rule in control["rules"]:
            assert rule.keys() == {"id", "permission", "flows", "messages", "key_exprs"}
            assert len(rule["flows"]) == 1
            assert set(rule["messages"]) < set(HARMLESS)
            assert rule["key_exprs"]
            assert set(rule["key_exprs"]) <= spelled
        for subject in control["subjects"]:
            assert subject["cert_common_names"] == [subject["id"]]


@settings(max_examples=20)
@given(data=st.data())
def test_every_rule_is_in_force_under_a_name_of_its_own(plans, data):
    plan = data.draw(plans)
    for identity in plan.identities:
        control = access_control(plan, identity)
        rules = [rule["id"] for rule in control["rules"]]
        assert len(set(rules)) == len(rules)
        assert sorted(name for entry in control["policies"] for name in entry["rules"]) == sorted(rules)
        subjects = [subject["id"] for subject in control["subjects"]]
        assert [entry["subjects"] for entry in control["policies"]] == [[subject] for subject in subjects]
        assert tuple(subjects) == plan.links[identity]


def test_the_evaluator_sees_a_rule_that_is_too_wide(make_plan):
    plan = make_plan()
    control = access_control(plan, "uav1")
    (rule,) = [rule for rule in control["rules"] if rule["id"] == "uav2 publishes"]
    rule["key_exprs"] = [f"{plan.swarm.name}/*/estimate"]
    found = evaluate(control, plan.identities, candidates(plan.swarm)) - promised(plan.swarm, "uav1")
    assert ("uav2", "egress", "put", "flock/uav3/estimate") in found
    assert {peer for peer, *_ in found} == {"uav2"}
