"""Access control for Zenoh, derived from the plan.

Every process has the rules of its own links; both ends of a link enforce them.
"""

from __future__ import annotations

from flockwire_core.wire.plan import Plan

Rule = dict[str, object]


def access_control(plan: Plan, identity: str) -> Rule:
    """Return Zenoh's access control for the process of `identity`: unlisted keys are denied, in both directions.

    Each link has rules for samples in both directions, and for their subscriptions in the opposite direction. Queries,
    replies, liveliness and deletions are in no rule. A router subscribes at its clients for others.
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
