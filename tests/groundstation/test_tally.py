from groundstation.service.string.tally import Tally


def test_a_tube_added_at_the_top_leaves_the_depths_of_the_others() -> None:
    order = Tally(2.0)
    order.on_hops(1, 1)
    assert order.tubes == [1]
    order.on_hops(2, 1)  # before tube 1 has heard that it is second now
    assert order.tubes == [2, 1]
    order.on_hops(1, 2)
    assert [order.length_below(tube) for tube in (2, 1)] == [2.0, 0.0]


def test_counts_decide_once_they_are_complete() -> None:
    order = Tally(2.0)
    for tube, hops in ((1, 3), (3, 1), (2, 2)):
        order.on_hops(tube, hops)
    assert order.tubes == [3, 2, 1]


def test_a_silent_tube_keeps_its_place_and_an_unknown_one_has_none() -> None:
    order = Tally(2.0)
    for tube, hops in ((3, 1), (2, 2), (1, 3), (3, 1)):
        order.on_hops(tube, hops)
    assert order.length_below(2) == 2.0
    assert order.length_below(9) is None
    order.on_hops(4, -1)
    assert 4 not in order.tubes


def test_a_restored_order_holds_until_reports_complete_another() -> None:
    order = Tally(2.0)
    order.restore([3, 2, 1])
    assert order.length_below(3) == 4.0
    for tube, hops in ((1, 4), (3, 2), (4, 1)):  # tube 4 came without a listener; tube 2 is still silent
        order.on_hops(tube, hops)
        assert [known for known in order.tubes if known != 4] == [3, 2, 1]
    assert order.tubes == [4, 3, 2, 1]
    order.on_hops(2, 3)
    assert order.tubes == [4, 3, 2, 1]


def test_a_string_of_which_too_few_tubes_are_known_does_not_reach_the_bit() -> None:
    """The tube was the first and, as far as is known, the last; the bit was two tubes deep when it surveyed."""
    order = Tally(2.0)
    assert not order.reaches(4.8, hops=1, below=0.0)
    assert order.reaches(4.8, hops=1, below=2.0)
    assert order.reaches(4.8, hops=2, below=0.0)
    assert order.reaches(4.8, hops=-1, below=0.0)
