"""What behaviors and laws are made of: parameters, fields in memory, views of the mission."""
