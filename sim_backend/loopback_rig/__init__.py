"""An emulated rig in real time: a loopback controller, and a camera rendered where it moves."""
