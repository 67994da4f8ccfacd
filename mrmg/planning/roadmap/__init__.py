"""Where robots can go at what energy: the probabilistic roadmap of a fleet.

`roadmap` builds it (ConstructPRM) and finds ways on it, `fleet` says what each robot
takes for them, `slopes` what climbing adds.
"""
