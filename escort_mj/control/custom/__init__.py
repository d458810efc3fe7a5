"""Components of plugins: what they see, how their parameters travel, and how they are called."""
