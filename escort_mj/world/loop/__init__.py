"""What runs natively inside MuJoCo's physics step: control, monitors, contacts, samples."""
