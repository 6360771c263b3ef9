"""Graphs and scenarios: which components run when, wired how, with which parameters."""
