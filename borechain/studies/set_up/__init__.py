"""Whether what is said of a hole holds, over rigs whose set-up errs as it is stated."""
