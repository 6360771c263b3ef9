"""Mistakes that reading does not find: the compiler does, and its words are put into one sentence."""

from tests.messages.mistakes import Mistake, inserted

RETURNS = "if p.slope > 1.0:\n        return rates, 1.0\n    return p.slope * angles + rates"
MISTAKES = [
    inserted("component of an unknown", "for i, a in enumerate(GAINS):\n    x.count = a.foo", "a number has no '.foo'",
             line="a.foo"),
    inserted("in a kernel that is called", "for i, a in enumerate(GAINS):\n    command.effort = leaned(a, torque, rates)",
             "a number has no '.slope'", line="return p.slope"),
    inserted("record in arithmetic", "for i, a in enumerate((attitude, attitude)):\n    x.count = a + 1",
             "attitude + 1 is not defined", line="a + 1"),
    inserted("misspelt field of an unknown", "for i, a in enumerate((attitude, attitude)):\n    command.effort = a.effort",
             "there is no 'effort' here", line="a.effort"),
    inserted("vector and quaternion", "for i, a in enumerate((torque, torque)):\n    command.effort = a + attitude.orientation",
             "Vec3 + Quaternion is not defined", line="a + attitude.orientation"),
    inserted("tuple of several kinds", "pair = (1.0, torque)\nfor i in range(x.count):\n    command.effort = pair[i] * torque",
             "different kinds: an index must be a constant", line="pair[i]"),
    inserted("copy of an array", "work = p.table[0].copy()\nx.count = int(work[0])", "this allocates memory", "stack_array",
             line="p.table[0].copy()"),
    inserted("two kinds", "turned = 1.0\nif t_ns > 5:\n    turned = torque\ncommand.effort = turned", "a Vec3"),
    Mistake("two kinds of results", "return p.slope * angles + rates", RETURNS, ("it returns different kinds",
            "return one kind"), "return p.slope * angles + rates"),
]
