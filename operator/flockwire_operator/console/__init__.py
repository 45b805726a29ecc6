"""`flockwire console`: a page that shows a flying swarm and gives orders."""
