"""What is noted of every solved physics step: clearances, contacts, effort, the truth; no law reads it."""
