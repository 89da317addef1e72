"""Orders and times in which legs swing: crawls, gaits, schedules, the gait state machine."""
