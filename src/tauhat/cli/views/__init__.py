"""Tables for people, one file per kind of result."""
