"""Round what is in the way: the shortest way among discs, the places beside them."""
