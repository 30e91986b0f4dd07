"""Monte Carlo campaigns: is the stated uncertainty of a plan true, over noise, tilt and azimuth?

A campaign simulates the means of the visits, not bytes: a million seeks take seconds. What it
says of drivers, dropped samples or a table that slips is nothing; whole runs are for that.
"""
