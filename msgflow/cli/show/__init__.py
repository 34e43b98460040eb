"""Results for people: what a terminal shows of them, and how they print themselves."""
