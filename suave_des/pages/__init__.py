"""Pages for a browser, each one file that needs no network: a campaign's report, and the replay of
a mission.
"""
