"""The access control of every process, judged by an evaluator of Zenoh's rules that knows nothing of how they came."""

import json
from itertools import product
from pathlib import Path

import pytest
import zenoh
from flockwire.runtime.session import BURST, SPARE_SESSIONS, configuration
from flockwire.security.credentials import Credentials
from flockwire.wire import access
from flockwire.wire.keys import ROWS, all_keys, key_text
from flockwire.wire.wiring import ROUTER, endpoints, identities
from hypothesis import given, settings
from hypothesis import strategies as st

FLOWS = ("egress", "ingress")
MESSAGES = (
    "put", "delete", "declare_subscriber", "query", "declare_queryable", "reply",
    "liveliness_token", "declare_liveliness_subscriber", "liveliness_query",
)  # fmt: skip
STRANGERS = ("", "stranger", "uav99", "UAV1", "uav1 ", "ca")
HARMLESS = "put", "declare_subscriber"
FILES = Credentials(Path("ca.crt"), Path("own.crt"), Path("own.key"))
CASES = tuple(product(("peers", "router"), ("nearby", "neighbours")))


def candidates(swarm):
    """Return all keys of the swarm as they stand on the wire, and what an attacker might ask for instead."""
    name = swarm.name
    return [
        *(key_text(swarm, key) for key in all_keys(swarm)),
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
    """Return all (peer, flow, message, key) that key table and graph allow `identity`, straight from the table."""
    cells = set()
    for key in all_keys(swarm):
        row, text = ROWS[key.kind], key_text(swarm, key)
        for speaker, listener in product(row.said_by(swarm, key.owner), row.heard_by(swarm, key.owner)):
            for sender, receiver in legs(swarm, speaker, listener):
                if sender == identity:
                    cells |= {(receiver, "egress", "put", text), (receiver, "ingress", "declare_subscriber", text)}
                if receiver == identity:
                    cells |= {(sender, "ingress", "put", text), (sender, "egress", "declare_subscriber", text)}
    return cells


def legs(swarm, speaker, listener):
    """Return the links that a message takes from `speaker` to `listener`."""
    if swarm.network.mode == "peers":
        return {(speaker, listener)} if speaker != listener else set()
    return {(a, b) for a, b in ((speaker, ROUTER), (ROUTER, listener)) if a != b}


@settings(max_examples=20)
@given(data=st.data())
def test_the_rules_allow_exactly_what_key_table_and_graph_do(swarms, data):
    swarm = data.draw(swarms)
    keys, peers = candidates(swarm), (*identities(swarm), *STRANGERS)
    for identity in identities(swarm):
        allowed = evaluate(policy.access_control(swarm, identity), peers, keys)
        expected = promised(swarm, identity)
        assert allowed - expected == set(), f"{identity} allows too much"
        assert expected - allowed == set(), f"{identity} allows too little"


@settings(max_examples=20)
@given(data=st.data())
def test_both_ends_of_a_link_guard_it(swarms, data):
    swarm = data.draw(swarms)
    keys, peers = candidates(swarm), identities(swarm)
    allowed = {identity: evaluate(policy.access_control(swarm, identity), peers, keys) for identity in peers}
    for identity, cells in allowed.items():
        for peer, flow, message, key in cells:
            other_end = "ingress" if flow == "egress" else "egress"
            assert (identity, other_end, message, key) in allowed[peer]


@settings(max_examples=15)
@given(data=st.data())
def test_what_a_follower_estimates_reaches_its_listeners_alone(swarms, data):
    """The information constraint itself, from the graph's edges: no rule lets an estimate anywhere else."""
    swarm = data.draw(swarms.filter(lambda swarm: swarm.network.mode == "peers"))
    edges = {(f"uav{edge[0]}", f"uav{edge[1]}") for edge in swarm.graph.edges}
    followers = [f"uav{i}" for i in swarm.followers]
    for speaker, listener in product(followers, followers):
        if speaker != listener:
            text = f"{swarm.name}/{speaker}/estimate"
            out = evaluate(policy.access_control(swarm, speaker), [listener], [text])
            back = evaluate(policy.access_control(swarm, listener), [speaker], [text])
            assert ((listener, "egress", "put", text) in out) == ((speaker, listener) in edges)
            assert ((speaker, "ingress", "put", text) in back) == ((speaker, listener) in edges)


@settings(max_examples=20)
@given(data=st.data())
def test_no_rule_has_a_wildcard_or_any_other_verb(swarms, data):
    swarm = data.draw(swarms)
    spelled = {key_text(swarm, key) for key in all_keys(swarm)}
    for identity in identities(swarm):
        control = policy.access_control(swarm, identity)
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
def test_every_rule_is_in_force_under_a_name_of_its_own(swarms, data):
    swarm = data.draw(swarms)
    for identity in identities(swarm):
        control = policy.access_control(swarm, identity)
        rules = [rule["id"] for rule in control["rules"]]
        assert len(set(rules)) == len(rules)
        assert sorted(name for entry in control["policies"] for name in entry["rules"]) == sorted(rules)
        subjects = [subject["id"] for subject in control["subjects"]]
        assert [entry["subjects"] for entry in control["policies"]] == [[subject] for subject in subjects]
        assert tuple(subjects) == policy.links(swarm, identity)


def test_the_evaluator_sees_a_rule_that_is_too_wide(make_swarm):
    swarm = make_swarm()
    control = policy.access_control(swarm, "uav1")
    (rule,) = [rule for rule in control["rules"] if rule["id"] == "uav2 says"]
    rule["key_exprs"] = [f"{swarm.name}/*/estimate"]
    found = evaluate(control, identities(swarm), candidates(swarm)) - promised(swarm, "uav1")
    assert ("uav2", "egress", "put", "flock/uav3/estimate") in found
    assert {peer for peer, *_ in found} == {"uav2"}


@pytest.mark.parametrize(("mode", "sensing"), CASES)
def test_zenoh_takes_every_processes_configuration(make_swarm, mode, sensing):
    swarm = make_swarm({"network.mode": mode, "avoidance.sensing": sensing})
    for identity in identities(swarm):
        config = zenoh.Config.from_json5(json.dumps(configuration(swarm, identity, FILES)))
        control = json.loads(config.get_json("access_control"))
        wanted = policy.access_control(swarm, identity)
        assert {rule["id"] for rule in control["rules"]} == {rule["id"] for rule in wanted["rules"]}
        assert (control["enabled"], control["default_permission"]) == (True, "deny")


@pytest.mark.parametrize(("mode", "sensing"), CASES)
def test_message_size_queues_and_sessions_are_bounded(make_swarm, mode, sensing):
    swarm = make_swarm({"network.mode": mode, "avoidance.sensing": sensing})
    for identity in identities(swarm):
        config = zenoh.Config.from_json5(json.dumps(configuration(swarm, identity, FILES)))
        assert json.loads(config.get_json("transport/link/rx/max_message_size")) == 65536
        assert json.loads(config.get_json("transport/link/tx/queue/size/real_time")) == BURST
        links = len(policy.links(swarm, identity))
        assert links < json.loads(config.get_json("transport/unicast/max_sessions")) <= links + SPARE_SESSIONS


@pytest.mark.parametrize("mode", ["peers", "router"])
def test_every_link_is_mutual_tls_and_none_is_found_by_itself(make_swarm, mode):
    swarm = make_swarm({"network.mode": mode})
    for identity in identities(swarm):
        config = configuration(swarm, identity, FILES)
        tls = config["transport"]["link"]["tls"]
        assert tls["enable_mtls"] is tls["verify_name_on_connect"] is tls["close_link_on_expiration"] is True
        for end in ("listen", "connect"):
            assert (tls[f"{end}_certificate"], tls[f"{end}_private_key"]) == ("own.crt", "own.key")
            assert all(where.startswith("tls/") for where in config[end]["endpoints"])
        assert {way["enabled"] for way in config["scouting"].values()} == {False}
        assert config["transport"]["shared_memory"] == {"enabled": False}


@pytest.mark.parametrize("mode", ["peers", "router"])
def test_everybody_dials_whom_the_policy_says_and_listens_at_his_own_endpoint(make_swarm, mode):
    swarm = make_swarm({"network.mode": mode})
    address = endpoints(swarm)
    for identity in identities(swarm):
        config = configuration(swarm, identity, FILES)
        own = [f"tls/{address[identity]}"] if identity in address else []
        assert config["listen"]["endpoints"] == own
        dialled = [f"tls/{address[other]}" for other in policy.dials(swarm, identity)]
        assert config["connect"]["endpoints"] == dialled
        kind = "peer" if mode == "peers" else "router" if identity == ROUTER else "client"
        assert config["mode"] == kind


@pytest.mark.parametrize("mode", ["peers", "router"])
def test_without_security_nothing_is_encrypted_and_sizes_stay_bounded(make_swarm, mode):
    swarm = make_swarm({"network.mode": mode, "network.security": "none"})
    for identity in identities(swarm):
        config = configuration(swarm, identity, None)
        assert "access_control" not in config
        assert "tls" not in config["transport"]["link"]
        zenoh.Config.from_json5(json.dumps(config))
        assert config["transport"]["link"]["rx"]["max_message_size"] == 65536
