"""What each robot knows by itself: what it sees, what it hears, and what it makes of both."""
