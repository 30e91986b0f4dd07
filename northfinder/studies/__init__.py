"""The papers worked through: every claim measured, with a verdict."""
