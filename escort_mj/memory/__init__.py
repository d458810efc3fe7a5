"""The memory of a mission: the fields of all components, laid out one behind the other, and packed."""
