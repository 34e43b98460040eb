"""Child processes, with bounds on memory and time, for the SQL of a person or an agent."""
