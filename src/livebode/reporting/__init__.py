"""The contents of the reports of one or two runs, as plain data; `livebode.report` lays them out."""
