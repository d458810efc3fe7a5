"""Mathematics that knows no mission: elementary functions, neighbor lists, random streams, even points."""
