"""Executables of this package: name -> module:attribute."""

EXECUTABLES = {}
