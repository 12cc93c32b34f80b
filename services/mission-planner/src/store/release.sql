-- Added by version 3 of the mission store.
ALTER TABLE transition ADD COLUMN release_problem TEXT;  -- why the payload was not let go
