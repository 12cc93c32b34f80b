-- Added by version 2 of the mission store.
CREATE TABLE formation (                 -- the last line of a leader is in force
    seq INTEGER PRIMARY KEY AUTOINCREMENT,
    leader TEXT NOT NULL,
    shape TEXT NOT NULL,
    spacing_m REAL NOT NULL,
    who TEXT NOT NULL,                   -- ordered or changed it
    stamp_ns INTEGER NOT NULL
) STRICT;

CREATE TABLE formation_slot (            -- none: disbanded
    formation INTEGER NOT NULL REFERENCES formation (seq),
    vehicle TEXT NOT NULL,
    named INTEGER NOT NULL,              -- the order named it
    forward_m REAL,                      -- NULL: named, and no longer in it
    right_m REAL,
    up_m REAL,
    PRIMARY KEY (formation, vehicle)
) STRICT;

CREATE TRIGGER formation_kept BEFORE UPDATE ON formation BEGIN SELECT RAISE(ABORT, 'append only'); END;
CREATE TRIGGER formation_stays BEFORE DELETE ON formation BEGIN SELECT RAISE(ABORT, 'append only'); END;
CREATE TRIGGER formation_slot_kept BEFORE UPDATE ON formation_slot BEGIN SELECT RAISE(ABORT, 'append only'); END;
CREATE TRIGGER formation_slot_stays BEFORE DELETE ON formation_slot BEGIN SELECT RAISE(ABORT, 'append only'); END;
