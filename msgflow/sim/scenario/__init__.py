"""Systems to simulate, as data: each module has those that show one idea."""
