-- The mission store, version 1; version 2 adds formation.sql, version 3 release.sql. Lines are only ever added: the triggers refuse anything else.
CREATE TABLE mission (
    seq INTEGER PRIMARY KEY AUTOINCREMENT,
    id TEXT NOT NULL UNIQUE,
    name TEXT NOT NULL,
    north_m REAL NOT NULL,               -- of the fleet's origin
    east_m REAL NOT NULL,
    survey_height_m REAL NOT NULL,       -- above mean water
    approval TEXT NOT NULL CHECK (approval IN ('manual', 'automatic')),
    dispatch_on_approval INTEGER NOT NULL,
    leader TEXT,                         -- NULL: the planner chooses
    follower TEXT
) STRICT;

CREATE TABLE transition (
    seq INTEGER PRIMARY KEY AUTOINCREMENT,
    mission TEXT NOT NULL REFERENCES mission (id),
    stamp_ns INTEGER NOT NULL,           -- since the Unix epoch, fleet time
    phase TEXT NOT NULL,                 -- entered
    who TEXT NOT NULL,
    why TEXT NOT NULL,
    leader TEXT,                         -- the mission as it was then
    follower TEXT,
    verdict TEXT,
    h_s_m REAL,                          -- significant wave height with its 95 % bounds
    h_s_m_low REAL,
    h_s_m_high REAL,
    touchdown_north_m REAL,
    touchdown_east_m REAL,
    paused_from TEXT,
    heading_rad REAL,                    -- of the leader over the spot
    abreast_m REAL NOT NULL,             -- of the follower's slot, to the right
    dispatch INTEGER NOT NULL,           -- a person asked for it
    reached_landing INTEGER NOT NULL,
    station_since_ns INTEGER,
    first_on_station_ns INTEGER
) STRICT;
CREATE INDEX transition_of_mission ON transition (mission, seq);

CREATE TABLE released (                  -- vehicles that a mission no longer needs
    seq INTEGER PRIMARY KEY AUTOINCREMENT,
    mission TEXT NOT NULL REFERENCES mission (id),
    vehicle TEXT NOT NULL,
    stamp_ns INTEGER NOT NULL
) STRICT;

CREATE TABLE generation (                -- plans up to this generation may have been issued
    seq INTEGER PRIMARY KEY AUTOINCREMENT,
    reserved INTEGER NOT NULL
) STRICT;

CREATE TRIGGER mission_kept BEFORE UPDATE ON mission BEGIN SELECT RAISE(ABORT, 'append only'); END;
CREATE TRIGGER mission_stays BEFORE DELETE ON mission BEGIN SELECT RAISE(ABORT, 'append only'); END;
CREATE TRIGGER transition_kept BEFORE UPDATE ON transition BEGIN SELECT RAISE(ABORT, 'append only'); END;
CREATE TRIGGER transition_stays BEFORE DELETE ON transition BEGIN SELECT RAISE(ABORT, 'append only'); END;
CREATE TRIGGER released_kept BEFORE UPDATE ON released BEGIN SELECT RAISE(ABORT, 'append only'); END;
CREATE TRIGGER released_stays BEFORE DELETE ON released BEGIN SELECT RAISE(ABORT, 'append only'); END;
CREATE TRIGGER generation_kept BEFORE UPDATE ON generation BEGIN SELECT RAISE(ABORT, 'append only'); END;
CREATE TRIGGER generation_stays BEFORE DELETE ON generation BEGIN SELECT RAISE(ABORT, 'append only'); END;
