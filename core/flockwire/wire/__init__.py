"""What goes over the wire, pure: processes, keys, who may publish and subscribe to what, messages and their codec."""
