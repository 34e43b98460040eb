"""Child processes, with bounds on memory and time, for what others made: their SQL, their bags."""
