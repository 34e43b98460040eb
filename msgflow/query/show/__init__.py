"""Results for people: words for values, tables that fit a screen, text and HTML."""
