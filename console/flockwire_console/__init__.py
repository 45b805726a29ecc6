"""`flockwire console`: a page that shows a swarm as it flies, and gives orders."""
