"""The controller, in pure numbers: behaviors, laws, their composition; knows no simulator."""
