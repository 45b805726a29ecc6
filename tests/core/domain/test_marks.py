from threading import Thread

from flockwire_core.domain.marks import Holding, marked, sometimes


def test_marks_are_counted_within_the_block_only():
    sometimes("before")
    with marked() as marks:
        sometimes("a")
        sometimes("b")
        sometimes("a")
    sometimes("after")
    assert marks == {"a": 2, "b": 1}


def test_a_block_within_another_counts_alone():
    with marked() as outer:
        sometimes("a")
        with marked() as inner:
            sometimes("b")
        sometimes("c")
    assert (outer, inner) == ({"a": 1, "c": 1}, {"b": 1})


def test_a_thread_counts_its_own():
    with marked() as marks:
        other = Thread(target=sometimes, args=("elsewhere",))
        other.start()
        other.join()
    assert marks == {}


def test_what_holds_on_is_one_event():
    holding = Holding()
    with marked() as marks:
        for names in (("a",), ("a", "b"), ("b",), (), ("b",)):
            holding.update(names)
    assert marks == {"a": 1, "b": 2}
