"""Access control for Zenoh, derived from the plan.

Every process holds the rules of its own links; between two processes both guard: what one may not publish to the other,
the other does not accept either.
"""

from __future__ import annotations

from flockwire.wire.plan import Plan

Rule = dict[str, object]


def access_control(plan: Plan, identity: str) -> Rule:
    """Return Zenoh's access control for the process of `identity`: what is not listed is denied, in both directions.

    For each link: the samples that may leave and come in, and the subscriptions that call for them, which go in the
    other direction. Queries, replies, liveliness and deletions are in no rule. A router subscribes at its clients in
    others' name.
    """
    rules, policies, subjects = [], [], []
    for other in plan.links[identity]:
        out, back = plan.passes(identity, other), plan.passes(other, identity)
        granted = (
            ("publishes", "egress", "put", out),
            ("accepts subscriptions", "ingress", "declare_subscriber", out),
            ("receives", "ingress", "put", back),
            ("subscribes", "egress", "declare_subscriber", back),
        )
        named = [
            {
                "id": f"{other} {name}",
                "permission": "allow",
                "flows": [flow],
                "messages": [message],
                "key_exprs": [plan.text(key) for key in keys],
            }
            for name, flow, message, keys in granted
            if keys
        ]
        rules += named
        subjects.append({"id": other, "cert_common_names": [other]})
        policies.append({"rules": [rule["id"] for rule in named], "subjects": [other]})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    }
