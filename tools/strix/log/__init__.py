"""What can be done with a log as a file: check it, recover it, look into it, convert it."""
