"""What a laboratory hands in: tables of measurements, photographs, sounds, testers' files, a
grain's mesh. Each is read, checked and made numbers in SI units or in the unit that its name ends
in."""
