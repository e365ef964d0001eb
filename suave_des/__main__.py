"""`python -m suave_des` is `suave-des`."""

from suave_des.entry import main

if __name__ == "__main__":
    main()
